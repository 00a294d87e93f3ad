"""DP services: what a telegram is for, by its service access points (IEC 61158-5-3; notes of pyprofibus)."""

from __future__ import annotations

from enum import Enum

from dissectors.profibus.control import FDL_STATUS
from dissectors.profibus.dpv1 import parse_acyclic
from dissectors.profibus.s7 import program_of
from dissectors.profibus.telegram import Telegram

MASTER_SAP = 62
"""The master's own access point in all services of a DP master of class 1."""


class Service(Enum):
    """A service; the value is the kind of a frame in lists and filters."""

    DATA_EXCHANGE = "data-exchange"
    SET_ADDRESS = "set-slave-address"
    READ_INPUTS = "read-inputs"
    READ_OUTPUTS = "read-outputs"
    GLOBAL_CONTROL = "global-control"
    GET_CONFIGURATION = "get-configuration"
    DIAGNOSIS = "slave-diagnosis"
    SET_PARAMETERS = "set-parameters"
    CHECK_CONFIGURATION = "check-configuration"
    EXTENDED_PARAMETERS = "extended-parameters"
    ALARM = "alarm"
    SERVER = "read-write"
    RESOURCE_MANAGER = "resource-manager"
    CONNECTION = "connection"
    MASTER_TO_MASTER = "master-to-master"
    FDL_STATUS = "fdl-status"
    TOKEN = "token"
    SHORT_ACKNOWLEDGE = "short-acknowledge"
    ACKNOWLEDGE = "acknowledge"  # an answer without data and without access points
    PROGRAM = "s7"  # no DP: programs of S7 controllers, on PPI and MPI
    OTHER = "fdl-data"

    @property
    def title(self) -> str:
        """As the standard writes it, or in words."""
        return _TITLES[self]


_TITLES = {
    Service.DATA_EXCHANGE: "Data_Exchange",
    Service.SET_ADDRESS: "Set_Slave_Add",
    Service.READ_INPUTS: "RD_Inp",
    Service.READ_OUTPUTS: "RD_Outp",
    Service.GLOBAL_CONTROL: "Global_Control",
    Service.GET_CONFIGURATION: "Get_Cfg",
    Service.DIAGNOSIS: "Slave_Diag",
    Service.SET_PARAMETERS: "Set_Prm",
    Service.CHECK_CONFIGURATION: "Chk_Cfg",
    Service.EXTENDED_PARAMETERS: "Ext_User_Prm",
    Service.ALARM: "DP-V1 alarm",
    Service.SERVER: "DP-V1 read or write",
    Service.RESOURCE_MANAGER: "DP-V1 resource manager",
    Service.CONNECTION: "DP-V1 connection",
    Service.MASTER_TO_MASTER: "master to master",
    Service.FDL_STATUS: "FDL status",
    Service.TOKEN: "token",
    Service.SHORT_ACKNOWLEDGE: "short acknowledgement",
    Service.ACKNOWLEDGE: "acknowledgement",
    Service.PROGRAM: "S7",
    Service.OTHER: "FDL data",
}

_BY_SAP = {
    49: Service.RESOURCE_MANAGER,
    50: Service.ALARM,
    51: Service.SERVER,
    53: Service.EXTENDED_PARAMETERS,
    54: Service.MASTER_TO_MASTER,
    55: Service.SET_ADDRESS,
    56: Service.READ_INPUTS,
    57: Service.READ_OUTPUTS,
    58: Service.GLOBAL_CONTROL,
    59: Service.GET_CONFIGURATION,
    60: Service.DIAGNOSIS,
    61: Service.SET_PARAMETERS,
    62: Service.CHECK_CONFIGURATION,
}
ACYCLIC = frozenset((Service.ALARM, Service.SERVER, Service.RESOURCE_MANAGER, Service.CONNECTION))
"""Services of DP-V1, whose data is a PDU of its own (`dpv1.py`)."""

_LAST_CONNECTION = 48
"""Access points 0 … 48 of a slave are for connections of masters of class 2, the resource manager gives them out."""

_SRD_HIGH = 0xD
"""How a master of class 1 asks for data exchange; who asks with low priority does something else."""


def service_of(telegram: Telegram) -> Service:
    """What a telegram is for, as far as it says itself: a bare acknowledgement may answer several things."""
    control = telegram.control
    if telegram.is_token:
        return Service.TOKEN
    if telegram.is_short:
        return Service.SHORT_ACKNOWLEDGE
    if control is None:
        return Service.OTHER
    if control.is_request and control.code == FDL_STATUS:
        return Service.FDL_STATUS
    point = slave_sap(telegram)
    if point is not None:
        if point <= _LAST_CONNECTION:
            return Service.CONNECTION if parse_acyclic(telegram.data, control.is_request) else _other(telegram)
        return _BY_SAP.get(point, Service.OTHER)
    if telegram.dsap is not None or telegram.ssap is not None:
        return Service.OTHER
    if program_of(telegram) is not None:
        return Service.PROGRAM
    if control.is_request:
        return Service.DATA_EXCHANGE if control.code == _SRD_HIGH else Service.OTHER
    return Service.DATA_EXCHANGE if telegram.data or control.code >= 8 else Service.ACKNOWLEDGE


def _other(telegram: Telegram) -> Service:
    return Service.OTHER if program_of(telegram) is None else Service.PROGRAM


def slave_sap(telegram: Telegram) -> int | None:
    """The slave's access point: where a request goes to, where an answer comes from."""
    return telegram.dsap if telegram.is_request else telegram.ssap


def sap_name(point: int | None, is_destination: bool, is_request: bool) -> str:
    """An access point with its name: that of the slave has one, that of the master says no more than whose it is."""
    if point is None:
        return ""
    if is_destination != is_request:
        return f"{point} (master)"
    service = Service.CONNECTION if point <= _LAST_CONNECTION else _BY_SAP.get(point)
    return f"{point} ({service.title})" if service is not None else f"{point}"
