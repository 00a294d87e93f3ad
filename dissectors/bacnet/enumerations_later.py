"""Numbers of later revisions of the standard that enumerations.py lacks (from the open BACnet stack's bacenum.h)."""

from __future__ import annotations

from dissectors.bacnet.enumerations import _table

NEWER: dict[str, dict[int, str]] = {
    "ConfirmedServiceChoice": _table(
        """
        34 auth-request
        """
    ),
    "ObjectType": _table(
        """
        63 color 64 color-temperature
        """
    ),
    "ErrorCode": _table(
        """
        1 authentication-failed 6 incompatible-security-levels 12 invalid-operator-name 15 key-generation-error
        28 security-not-supported 139 invalid-operation-in-this-state 200 certificate-expired 201
        certificate-invalid 202 certificate-malformed 203 certificate-revoked 204 unknown-security-key 205
        referenced-port-in-error 206 not-enabled 207 adjust-scope-required 208 auth-scope-required 209
        bind-scope-required 210 config-scope-required 211 control-scope-required 212 extended-scope-required 213
        incorrect-client 214 install-scope-required 215 insufficient-scope 216 no-default-scope 217 no-policy
        218 revoked-token 219 override-scope-required 220 inactive-token 221 unknown-audience 222 unknown-client
        223 unknown-scope 224 view-scope-required 225 incorrect-audience 226 incorrect-client-origin 227
        invalid-array-size 228 incorrect-issuer 229 invalid-token
        """
    ),
    "RejectReason": _table(
        """
        10 invalid-data-encoding
        """
    ),
    "EventType": _table(
        """
        6 complex-event-type
        """
    ),
    "PropertyIdentifier": _table(
        """
        18 blank-1 95 protocol-conformance-class 101 recipient 129 current-notify-time 138 previous-notify-time
        508 additional-reference-ports 509 certificate-signing-request-file 510 command-validation-result 511
        issuer-certificate-files 4194304 max-bvlc-length-accepted 4194305 max-npdu-length-accepted 4194306
        operational-certificate-file 4194307 current-health 4194308 sc-connect-wait-timeout 4194309
        sc-direct-connect-accept-enable 4194310 sc-direct-connect-accept-uris 4194311 sc-direct-connect-binding
        4194312 sc-direct-connect-connection-status 4194313 sc-direct-connect-initiate-enable 4194314
        sc-disconnect-wait-timeout 4194315 sc-failed-connection-requests 4194316
        sc-failover-hub-connection-status 4194317 sc-failover-hub-uri 4194318 sc-hub-connector-state 4194319
        sc-hub-function-accept-uris 4194320 sc-hub-function-binding 4194321 sc-hub-function-connection-status
        4194322 sc-hub-function-enable 4194323 sc-heartbeat-timeout 4194324 sc-primary-hub-connection-status
        4194325 sc-primary-hub-uri 4194326 sc-maximum-reconnect-time 4194327 sc-minimum-reconnect-time 4194328
        color-override 4194329 color-reference 4194330 default-color 4194331 default-color-temperature 4194332
        override-color-reference 4194334 color-command 4194335 high-end-trim 4194336 low-end-trim 4194337
        trim-fade-time 4194338 device-address-proxy-enable 4194339 device-address-proxy-table 4194340
        device-address-proxy-timeout 4194341 default-on-value 4194342 last-on-value 4194343 authorization-cache
        4194344 authorization-groups 4194345 authorization-policy 4194346 authorization-scope 4194347
        authorization-server 4194348 authorization-status 4194349 max-proxied-i-ams-per-second
        """
    ),
    "EngineeringUnits": _table(
        """
        252 mole-percent 254 million-standard-cubic-feet-per-minute 47808 standard-cubic-feet-per-day 47809
        million-standard-cubic-feet-per-day 47810 thousand-cubic-feet-per-day 47811
        thousand-standard-cubic-feet-per-day 47812 pounds-mass-per-day 47814 millirems 47815 millirems-per-hour
        47816 degrees-lovibond 47817 alcohol-by-volume 47818 international-bittering-units 47819
        european-bitterness-units 47820 degrees-plato 47821 specific-gravity 47822 european-brewing-convention
        47823 per-day 47824 per-millisecond 47825 yards 47826 miles 47827 nautical-miles 47828 nanograms 47829
        micrograms 47830 metric-tonnes 47831 short-tons 47832 long-tons 47833 grams-per-hour 47834 grams-per-day
        47835 kilograms-per-day 47836 short-tons-per-second 47837 short-tons-per-minute 47838
        short-tons-per-hour 47839 short-tons-per-day 47840 metric-tonnes-per-second 47841
        metric-tonnes-per-minute 47842 metric-tonnes-per-hour 47843 metric-tonnes-per-day 47844
        long-tons-per-second 47845 long-tons-per-minute 47846 long-tons-per-hour 47847 long-tons-per-day 47848
        btus-per-second 47849 btus-per-minute 47850 btus-per-day 47851 kilo-btus-per-second 47852
        kilo-btus-per-minute 47853 kilo-btus-per-day 47854 mega-btus-per-second 47855 mega-btus-per-minute 47856
        mega-btus-per-hour 47857 mega-btus-per-day 47858 joules-per-second 47859 joules-per-minute 47860
        joules-per-day 47861 kilojoules-per-second 47862 kilojoules-per-minute 47863 kilojoules-per-hour 47864
        kilojoules-per-day 47865 megajoules-per-second 47866 megajoules-per-minute 47867 megajoules-per-hour
        47868 megajoules-per-day 47869 degrees-celsius-per-day 47870 kelvin-per-day 47871
        degrees-fahrenheit-per-day 47872 delta-degrees-celsius 47873 million-cubic-feet-per-minute 47874
        million-cubic-feet-per-day 47875 imperial-gallons-per-second 47876 imperial-gallons-per-hour 47877
        imperial-gallons-per-day 47878 liters-per-day 47879 us-gallons-per-second 47880 us-gallons-per-day 47881
        percent-per-minute 47882 percent-per-hour 47883 percent-per-day 47884 per-million 47885 per-billion
        47886 micrograms-per-gram 47887 nanograms-per-gram 47888 micrograms-per-kilogram 47889
        nanograms-per-kilogram 47890 milligrams-per-milliliter 47891 micrograms-per-milliliter 47892
        nanograms-per-milliliter 47893 kilograms-per-liter 47894 nanograms-per-liter 47895
        milligrams-per-cubic-centimeter 47896 micrograms-per-cubic-centimeter 47897
        nanograms-per-cubic-centimeter 47898 btu-per-hour-per-watt 47899 btu-per-watt-hour-seasonal 47900
        coefficient-of-performance 47901 coefficient-of-performance-seasonal 47902
        kilowatt-per-ton-refrigeration 47903 lumens-per-watt 47904 pound-force-feet 47905 pound-force-inches
        47906 ounce-force-inches 47907 pounds-force-per-square-inch-absolute 47908
        pounds-force-per-square-inch-gauge 47909 microsiemens-per-centimeter 47910 millisiemens-per-centimeter
        47911 millisiemens-per-meter 47912 millions-of-us-gallons 47913 millions-of-imperial-gallons 47914
        milliliters-per-minute 47915 mils-per-year 47916 millimeters-per-year 47917 pulses-per-minute 47918
        active-energy-pulse-value 47919 reactive-energy-pulse-value 47920 apparent-energy-pulse-value 47921
        volt-squared-hour-pulse-value 47922 ampere-squared-hour-pulse-value 47923 cubic-meter-pulse-value 47924
        gigawatts 47925 gigajoules 47926 terajoules 47927 gigawatt-hours 47928 gigawatt-reactive-hours 47929
        bits-per-second 47930 kilobits-per-second 47931 megabits-per-second 47932 gigabits-per-second 47933
        bytes-per-second 47934 kilobytes-per-second 47935 megabytes-per-second 47936 gigabytes-per-second 47937
        volume1 47938 volume2 47939 volume3 47940 volume4 47941 volume5 47942 volume6 47943 volume7 47944
        volume8 47945 volume9 47946 volume10 47947 volumetric-flow1 47948 volumetric-flow2 47949
        volumetric-flow3 47950 volumetric-flow4 47951 volumetric-flow5 47952 volumetric-flow6 47953
        volumetric-flow7 47954 volumetric-flow8 47955 volumetric-flow9 47956 volumetric-flow10 47958 site-unit1
        47959 site-unit2 47960 site-unit3 47961 site-unit4 47962 site-unit5 47963 site-unit6 47964 site-unit7
        47965 site-unit8 47966 site-unit9 47967 site-unit10 47968 particles-per-cubic-foot 47969
        particles-per-cubic-meter 47970 picocuries-per-liter 47971 becquerels-per-cubic-meter 47972
        grains-of-water-per-pound-dry-air 47973 degree-hours-celsius 47974 degree-hours-fahrenheit 47975
        degree-minutes-celsius 47976 degree-minutes-fahrenheit 47977 degree-seconds-celsius 47978
        degree-seconds-fahrenheit 47979 microseconds 47980 nanoseconds 47981 picoseconds
        """
    ),
    "AccessEvent": _table(
        """
        16 no-entry-after-grant
        """
    ),
    "BinaryLightingPV": _table(
        """
        6 toggle
        """
    ),
    "DoorStatus": _table(
        """
        3 door-fault 4 unused 5 none 6 closing 7 opening 8 safety-locked 9 limited-opened
        """
    ),
    "LifeSafetyMode": _table(
        """
        15 activated-oeo-alarm 16 activated-oeo-evacuate 17 activated-oeo-phase1-recall 18
        activated-oeo-unavailable 19 deactivated
        """
    ),
    "LifeSafetyState": _table(
        """
        24 non-default-mode 25 oeo-unavailable 26 oeo-alarm 27 oeo-phase1-recall 28 oeo-evacuate 29
        oeo-unaffected 30 test-oeo-unavailable 31 test-oeo-alarm 32 test-oeo-phase1-recall 33 test-oeo-evacuate
        34 test-oeo-unaffected
        """
    ),
    "LightingInProgress": _table(
        """
        5 trim-active
        """
    ),
    "LightingOperation": _table(
        """
        11 restore-on 12 default-on 13 toggle-restore 14 toggle-default
        """
    ),
    "NetworkType": _table(
        """
        8 non-bacnet 11 secure-connect
        """
    ),
    "SuccessFilter": _table(
        """
        0 all 1 successes-only 2 failures-only
        """
    ),
}

NEWER_BITS: dict[str, dict[int, str]] = {
    "ObjectTypesSupported": _table(
        """
        31 timer 63 color 64 color-temperature
        """
    ),
    "ServicesSupported": _table(
        """
        13 read-property-conditional 24 authenticate 25 request-key 49 auth-request
        """
    ),
}
"""The same of named bits; 13, 24 and 25 are services that devices of old have and the standard has no more."""
