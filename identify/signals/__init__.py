"""From recorded positions to velocities, accelerations and filtered, decimated columns."""
