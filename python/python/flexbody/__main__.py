"""`python -m flexbody` is the command `flexbody`."""

import sys

from ._command import main

if __name__ == "__main__":
    sys.exit(main())
