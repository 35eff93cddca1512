"""The constants that decide names and verdicts: all of them, with their reasons.

What else is a number in the diagnosis follows from these, from the number of samples or of tests, or is a guard of arithmetic, a
bound of work or the size of a table. `docs/diagnosis.md` has them as a table, with what halving and doubling each does
(`make sensitivity`).
"""

SIGNIFICANCE = 0.01
"""probability, corrected for all that was tried, below which evidence counts"""
FOLDS = 10
"""stretches of every session left out in turn"""
STRETCHES = 8
"""stretches of the motion left out in turn where what is left is foretold without a model"""
FEWEST_FOLDS = 2
"""folds whose scatter tells nothing: what acts in so many or fewer is not called missing"""
LEAST_DROP = 0.015
"""An effect must lower the held-out error of its joint by at least this part of it: what is smaller no operator would
call missing, and small systematic errors of filters and encoders lie below it."""
DROP_PER_PARAMETER = 0.0025
"""How much more each further parameter or constant must bring; what anything must bring of what the usual model leaves; and by
how much one candidate must do better than another: after a large effect is added, small remains of its approximation stand
out of the noise, which are significant and no operator's business."""
LEAST_OF_TORQUE = 2.5e-4
"""Part of the joint's torque (root mean square) that an effect must explain: below lies what filters, stops and the
rounding of encoders leave, on the quietest of machines."""
MOST = 0.5
"""More than half of it, where one of two must prevail."""
NEARLY_ALL = 0.9
"""Nearly the same: of what a free function takes away, with which an effect of the same variable is the cause and not its
imitation (a spring with a little play explains nine tenths as a straight line, one that acts on one side only two thirds at
most)."""
LEAST_SHARE = 0.1
"""Part of the residual's power that must be predictable, beyond what noise itself is, before it is called structure: an effect
worth a twentieth of the error. What takes so much away need not be steady."""
STANDS_OUT = 6.0
"""Robust standard deviations (1.4826 times the median of the absolute values) beyond which what is left stands out of noise:
means over 0.1 s that do are a blow, single samples are cut there. Normal noise has 5 at most, what models leave of real
machines a little more."""
NOISE_TIME = 0.2
"""s, correlation time of the slowest noise of an amplifier, a filter or a current sensor: e^(-t/0.2 s)"""
NOISE_MEMORY = 0.3
"""s after which such noise has forgotten itself: it is predicted to a tenth from there on, from 0.1 s on to a half"""
LOUD = 0.03
"""part of the torque (root mean square) above which what is left is no noise of an amplifier; samples count from `NOISE_TIME`
on, from where a wind of up to 1.5 Hz shows"""
BAND = 2.0
"""Times the band of the motion at which the positions of instruments are low-passed: harmonics of the motion's corners pass,
which tell a delay from nothing; at four times a disturbance with a corner of 3 Hz comes through and a delay of -2.1 +/- 0.7 ms
is found where there is none."""
WORSE = 2.0
"""Times the error of the fit's sessions, relative to the torque and absolute, that noise and the parameters' deviations
do not make on others: a payload or a gain that is not what was declared."""
STRUCTURE_RIGHT = 0.9
"""Part of the joints with an uncatalogued cause that are called unexplained (docs/blind.md), and the other way round."""
