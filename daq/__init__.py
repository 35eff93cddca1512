"""Planning, acquisition, recording and the payload session."""
