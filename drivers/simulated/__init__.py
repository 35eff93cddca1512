"""A rig that does not exist: CANopen drives of our own making with a mechanism behind them."""
