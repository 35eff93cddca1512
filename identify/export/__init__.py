"""An identified model in the form that somebody else's program takes, with a certificate of what that costs."""
