"""Tables and figures of chapters 4 and 8 of the thesis again: what scripts/reproduce.py is made of."""
