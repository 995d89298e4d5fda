"""The paper in slow, plain NumPy: written from its equations, sharing no code with the library."""
