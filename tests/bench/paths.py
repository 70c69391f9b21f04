"""Where bench's modules are; ends with ctest's code for "skipped" if a package that they need is absent."""
import pathlib
import sys

BIN, SOURCE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
sys.path.insert(0, str(SOURCE / 'bench'))

try:
    import jinja2, matplotlib, numpy, PIL, yaml  # noqa: E401, F401
except ImportError as error:
    print(f"skipped: Python's {error.name} is missing: deploy/setup --bench installs it")
    sys.exit(77)
