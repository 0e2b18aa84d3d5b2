"""`python -m hil` is `hil`, for debuggers and where the script is not on the path."""

from hil.cli import main

if __name__ == "__main__":
    main()
