"""The rigid robot: geometry, regressor, base parameters, payloads."""
