"""Runs the command line as ``python -m tvident``, where the program is not on the path."""

from tvident._command_line import main

if __name__ == "__main__":
    main(prog_name="tvident")
