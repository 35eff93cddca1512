"""How well a model predicts what was measured."""
