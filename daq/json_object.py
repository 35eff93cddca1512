"""An object of a JSON text."""

from typing import Any

JsonObject = dict[str, Any]
"""What is written into a recording's attributes, told to a browser, or handed to the simulated plant, which checks it.
Any: JSON values nest freely, and daq itself reads none of their fields without checking them."""
