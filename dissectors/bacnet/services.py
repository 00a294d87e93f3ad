"""The parameters of every BACnet service, in the notation of layout.py (ANSI/ASHRAE 135, clauses 13 to 17 and 21).

A service that is not here, or parameters that do not fit, are given as a tree of tags.
"""

from __future__ import annotations

from dissectors.bacnet import names

_TARGET = (
    "[0] object-identifier ObjectIdentifier, [1] property-identifier PropertyIdentifier, "
    "[2]? property-array-index Unsigned"
)
_COV = (
    "[0] subscriber-process-identifier Unsigned, [1] initiating-device-identifier ObjectIdentifier, "
    "[2] monitored-object-identifier ObjectIdentifier, [3] time-remaining Unsigned, [4] list-of-values {PropertyValue}"
)
_EVENT = (
    "[0] process-identifier Unsigned, [1] initiating-device-identifier ObjectIdentifier, "
    "[2] event-object-identifier ObjectIdentifier, [3] time-stamp TimeStamp, [4] notification-class Unsigned, "
    "[5] priority Unsigned, [6] event-type EventType, [7]? message-text CharacterString, [8] notify-type NotifyType, "
    "[9]? ack-required Boolean, [10]? from-state EventState, [11] to-state EventState, "
    "[12]? event-values NotificationParameters"
)
_COV_MULTIPLE = (
    "[0] subscriber-process-identifier Unsigned, [1] initiating-device-identifier ObjectIdentifier, "
    "[2] time-remaining Unsigned, [3]? timestamp DateTime, [4] list-of-cov-notifications {COVNotification}"
)
_AUDIT = "[0] notifications {AuditNotification}"
_TEXT_MESSAGE = (
    "[0] text-message-source-device ObjectIdentifier, "
    "[1]? message-class ConfirmedTextMessageRequestMessageClass, "
    "[2] message-priority ConfirmedTextMessageRequestMessagePriority, [3] message CharacterString"
)
_PRIVATE = "[0] vendor-id Unsigned, [1] service-number Unsigned, [2]? service-parameters Any"
_CHANGE_LIST = _TARGET + ", [3] list-of-elements Any"

CONFIRMED: dict[int, str] = {
    0: "[0] acknowledging-process-identifier Unsigned, [1] event-object-identifier ObjectIdentifier, "
    "[2] event-state-acknowledged EventState, [3] time-stamp TimeStamp, [4] acknowledgment-source CharacterString, "
    "[5] time-of-acknowledgment TimeStamp",
    1: _COV,
    2: _EVENT,
    3: "",
    4: "[0] acknowledgment-filter GetEnrollmentSummaryRequestAcknowledgmentFilterType, "
    "[1]? enrollment-filter RecipientProcess, "
    "[2]? event-state-filter GetEnrollmentSummaryRequestEventStateFilterType, "
    "[3]? event-type-filter EventType, [4]? priority-filter GetEnrollmentSummaryRequestPriorityFilterType, "
    "[5]? notification-class-filter Unsigned",
    5: "[0] subscriber-process-identifier Unsigned, [1] monitored-object-identifier ObjectIdentifier, "
    "[2]? issue-confirmed-notifications Boolean, [3]? lifetime Unsigned",
    6: "file-identifier ObjectIdentifier, access-method AtomicReadFileRequestAccessMethodChoice",
    7: "file-identifier ObjectIdentifier, access-method AtomicWriteFileRequestAccessMethodChoice",
    8: _CHANGE_LIST,
    9: _CHANGE_LIST,
    10: "[0] object-specifier CreateObjectRequestObjectSpecifier, [1]? list-of-initial-values {PropertyValue}",
    11: "object-identifier ObjectIdentifier",
    12: _TARGET,
    14: "list-of-read-access-specs {ReadAccessSpecification}",
    15: _TARGET + ", [3] property-value Any, [4]? priority Unsigned",
    16: "list-of-write-access-specs {WriteAccessSpecification}",
    17: "[0]? time-duration Unsigned, [1] enable-disable DeviceCommunicationControlRequestEnableDisable, "
    "[2]? password CharacterString",
    18: _PRIVATE,
    19: _TEXT_MESSAGE,
    20: "[0] reinitialized-state-of-device ReinitializeDeviceRequestReinitializedStateOfDevice, "
    "[1]? password CharacterString",
    21: "vt-class VTClass, local-vt-session-identifier Unsigned",
    22: "list-of-remote-vt-session-identifiers {Unsigned}",
    23: "vt-session-identifier Unsigned, vt-new-data OctetString, vt-data-flag Unsigned",
    24: "[0] pseudo-random-number Unsigned, [1]? expected-invoke-id Unsigned, [2]? operator-name CharacterString, "
    "[3]? operator-password CharacterString, [4]? start-enciphered-session Boolean",
    25: "requesting-device-identifier ObjectIdentifier, requesting-device-address DeviceAddress, "
    "remote-device-identifier ObjectIdentifier, remote-device-address DeviceAddress",
    26: _TARGET + ", ? range Range",
    27: "[0] requesting-process-identifier Unsigned, [1] requesting-source CharacterString, "
    "[2] request LifeSafetyOperation, [3]? object-identifier ObjectIdentifier",
    28: "[0] subscriber-process-identifier Unsigned, [1] monitored-object-identifier ObjectIdentifier, "
    "[2]? issue-confirmed-notifications Boolean, [3]? lifetime Unsigned, "
    "[4] monitored-property-identifier PropertyReference, [5]? cov-increment Real",
    29: "[0]? last-received-object-identifier ObjectIdentifier",
    30: "[0] subscriber-process-identifier Unsigned, [1]? issue-confirmed-notifications Boolean, "
    "[2]? lifetime Unsigned, [3]? max-notification-delay Unsigned, "
    "[4] list-of-cov-subscription-specifications {COVMultipleSubscriptionList}",
    31: _COV_MULTIPLE,
    32: _AUDIT,
    33: "[0] audit-log ObjectIdentifier, [1] query-parameters AuditLogQueryParameters, "
    "[2]? start-at-sequence-number Unsigned, [3] requested-count Unsigned",
}

ACK: dict[int, str] = {
    3: "list-of-alarm-summaries {GetAlarmSummaryAlarmSummary}",
    4: "list-of-enrollment-summaries {GetEnrollmentSummaryEnrollmentSummary}",
    6: "end-of-file Boolean, access-method AtomicReadFileACKAccessMethodChoice",
    7: "[0]? file-start-position Signed, [1]? file-start-record Signed",
    10: "object-identifier ObjectIdentifier",
    12: _TARGET + ", [3] property-value Any",
    14: "list-of-read-access-results {ReadAccessResult}",
    18: "[0] vendor-id Unsigned, [1] service-number Unsigned, [2]? result-block Any",
    21: "remote-vt-session-identifier Unsigned",
    23: "[0] all-new-data-accepted Boolean, [1]? accepted-octet-count Unsigned",
    24: "modified-random-number Unsigned",
    26: _TARGET + ", [3] result-flags ResultFlags, [4] item-count Unsigned, [5] item-data Any, "
    "[6]? first-sequence-number Unsigned",
    29: "[0] list-of-event-summaries {GetEventInformationEventSummary}, [1] more-events Boolean",
    33: "[0] audit-log ObjectIdentifier, [1] records {AuditLogRecordResult}, [2] no-more-items Boolean",
}

UNCONFIRMED: dict[int, str] = {
    0: "i-am-device-identifier ObjectIdentifier, max-apdu-length-accepted Unsigned, "
    "segmentation-supported Segmentation, vendor-id Unsigned",
    1: "device-identifier ObjectIdentifier, object-identifier ObjectIdentifier, object-name CharacterString",
    2: _COV,
    3: _EVENT,
    4: _PRIVATE,
    5: _TEXT_MESSAGE,
    6: "time DateTime",
    7: "[0]? device-instance-range-low-limit Unsigned, [1]? device-instance-range-high-limit Unsigned, "
    "[2]? object-identifier ObjectIdentifier, [3]? object-name CharacterString",
    8: "[0]? device-instance-range-low-limit Unsigned, [1]? device-instance-range-high-limit Unsigned",
    9: "time DateTime",
    10: "[0] group-number Unsigned, [1] write-priority Unsigned, [2] change-list {GroupChannelValue}, "
    "[3]? inhibit-delay Boolean",
    11: _COV_MULTIPLE,
    12: _AUDIT,
    13: "vendor-id Unsigned, model-name CharacterString, serial-number CharacterString",
    14: "vendor-id Unsigned, model-name CharacterString, serial-number CharacterString, "
    "? device-identifier ObjectIdentifier, ? device-mac-address OctetString",
}

_PLAIN_ERROR = "error-class ErrorClass, error-code ErrorCode"
_CHANGE_LIST_ERROR = "[0] error-type ErrorType, [1] first-failed-element-number Unsigned"

ERROR: dict[int, str] = {
    8: _CHANGE_LIST_ERROR,
    9: _CHANGE_LIST_ERROR,
    10: _CHANGE_LIST_ERROR,
    16: "[0] error-type ErrorType, [1] first-failed-write-attempt ObjectPropertyReference",
    18: "[0] error-type ErrorType, [1] vendor-id Unsigned, [2] service-number Unsigned, [3]? error-parameters Any",
    22: "[0] error-type ErrorType, [1]? list-of-vt-session-identifiers {Unsigned}",
    30: "[0]? error-type ErrorType, [1]? first-failed-subscription COVSubscriptionFailure",
}
"""Services whose Error-PDU is more than class and code."""


def parameters(apdu_type: int, service: int) -> str | None:
    """The layout of the parameters of an APDU type (0 … 7) and service; None when there is none in the tables."""
    match apdu_type:
        case 0:
            return CONFIRMED.get(service)
        case 1:
            return UNCONFIRMED.get(service)
        case 2:
            return ""
        case 3:
            return ACK.get(service)
        case 5:
            return ERROR.get(service, _PLAIN_ERROR)
    return None


def service_name(apdu_type: int, service: int) -> str:
    """Its name, or "service-40"."""
    table = names.UNCONFIRMED if apdu_type == 1 else names.CONFIRMED
    return table.get(service) or f"service-{service}"
