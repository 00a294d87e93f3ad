"""`python -m sniff`."""

import sys

from sniff.cli.process import run

sys.exit(run())
