"""Settings of all tests: how many examples hypothesis makes.

The suite is to run in minutes on two cores and to say the same of the same code each time: its examples are drawn from
the test, not by chance. `HYPOTHESIS_PROFILE=thorough` searches longer, and elsewhere each time. No example has a
deadline: how long one takes depends on what else the machine does.
"""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

SLOW = [HealthCheck.too_slow]
settings.register_profile("suite", max_examples=40, deadline=None, derandomize=True, suppress_health_check=SLOW)
settings.register_profile("thorough", max_examples=1000, deadline=None, suppress_health_check=SLOW)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "suite"))
