"""The commands of `coulomb`, one file each."""
