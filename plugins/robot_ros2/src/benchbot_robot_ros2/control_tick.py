"""The tick of a robot's control: how long one lasts, and what is done meanwhile."""

CONTROL_PERIOD_S = 0.05
# How often, in wall time, a command is repeated while its tick lasts: that of a simulated robot may last for long.
REPEAT_S = 0.03
# A tick that is nearly over is over: the rest may be rounding, which simulated time passes only with its next step.
SLACK_S = 1e-3
