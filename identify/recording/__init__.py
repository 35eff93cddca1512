"""The experiment on disk."""
