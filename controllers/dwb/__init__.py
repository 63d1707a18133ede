"""DWB, Nav2's Dynamic Window controller."""
