"""The Graceful Controller."""
