"""Forward dynamics of an identified model: how well it predicts motion, not only torque."""
