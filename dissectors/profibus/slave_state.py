"""The states of a DP slave, as the bus shows them.

offline ──Slave_Diag──► wait for parameters ──Set_Prm──► wait for configuration ──Chk_Cfg──► ready ──► data exchange
   ▲                          ▲                                                                            │
   └── answers nothing        └── diagnosis that wants parameters, service not activated, unlocked ◄───────┘
"""

from __future__ import annotations

from enum import Enum


class SlaveState(Enum):
    """Where a slave is on its way to exchanging data."""

    OFFLINE = "offline"
    WAIT_PARAMETERS = "wait for parameters"
    WAIT_CONFIGURATION = "wait for configuration"
    CONFIGURED = "configured"  # all was given and acknowledged, nothing exchanged yet
    EXCHANGE = "data exchange"
