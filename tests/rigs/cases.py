"""How a script of cases is run: a case is a function whose name begins with ``case_``, and asserts by itself."""

import sys

_PREFIX = "case_"


def wanted(names):
    """The cases among ``names`` (a script's ``globals()``) that the arguments name; all if they name none."""
    named = [word for word in sys.argv[1:] if word.startswith(_PREFIX)]
    return named or sorted([name for name in names if name.startswith(_PREFIX)])


def run(names):
    """Run them and print the name of each that holds; the first that does not ends the script."""
    for name in wanted(names):
        names[name]()
        print(name)
