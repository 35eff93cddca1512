"""The two drives of a proof's plan, and what people call them."""

from typing import Literal

Drive = Literal["without", "with"]
"""without feedforward torque, then with it"""

ORDINAL: dict[Drive, str] = {"without": "first", "with": "second"}
"""run of the proof"""
