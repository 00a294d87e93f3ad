"""The filter language of the command line, the terminal UI, the configuration and triggers."""

from sniff.filter.compiling import check_filter, compile_filter
from sniff.filter.errors import FilterError
from sniff.filter.plan import Filter
from sniff.filter.scope import Scope

__all__ = ["Filter", "FilterError", "Scope", "check_filter", "compile_filter"]
