"""``python -m fem_reference.cli``."""

import sys

from fem_reference.cli import main

sys.exit(main())
