"""`python -m sitl` is `tiltwing-sitl`."""

import sys

from sitl.cli import main

sys.exit(main())
