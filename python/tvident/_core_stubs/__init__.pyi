# What `_core.pyi` is made of, for type checkers alone: nothing here exists when the program runs.
