"""Physical effects: each an object that adds columns to the regressor."""
