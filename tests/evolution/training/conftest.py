import signal

import pytest


@pytest.fixture(autouse=True)
def _heeded_signals():
    """Undo that a shell ignores SIGINT in the background and ``nohup`` ignores SIGHUP, which tests inherit."""
    heeded = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in heeded.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
