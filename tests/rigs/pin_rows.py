"""Rows of the arm record for outputs and inputs: a switch that is active low, a servo, a sensor."""

PUMP = {"pin": 0x30, "timer": 0, "channel": 0, "spare": 0, "prescaler": 0, "period": 0}
PUMP.update(low=1, high=0, safe=0)
GRIPPER = dict(
    PUMP, pin=0x18, timer=10, channel=1, prescaler=51, period=64614, low=1615, high=8077, safe=7282
)
PART = {"pin": 0x31, "active_high": 0, "debounce_ms": 10}
