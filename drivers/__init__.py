"""The bus, the CiA 402 drive, the SYNC source, the scale, and a simulated rig."""
