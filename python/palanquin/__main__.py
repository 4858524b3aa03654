"""`python -m palanquin`: the command line."""

from palanquin.cli import app

if __name__ == "__main__":
    app(prog_name="python -m palanquin")
