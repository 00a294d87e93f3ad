"""`python -m sniff`."""

import sys

from sniff.cli import main

sys.exit(main())
