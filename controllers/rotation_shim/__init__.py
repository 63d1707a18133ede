"""The Rotation Shim Controller."""
