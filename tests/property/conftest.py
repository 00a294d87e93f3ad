"""Failures inside the shared contract suite show their values like those of a test module."""

import pytest

pytest.register_assert_rewrite("tests.property.framer_contract")
