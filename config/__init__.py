"""Rigs, drives, payloads and plans: the settings that an operator edits (YAML)."""
