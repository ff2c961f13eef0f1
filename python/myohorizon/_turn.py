# SPDX-License-Identifier: Apache-2.0
"""Whose turn it is at an estimator: one thread may use it at a time."""
import threading

from .errors import ClosedError, ThreadError


class Turn:
    """One thread at a time; another is refused, not kept waiting. None once last() was asked for.

    The lock is one that its own thread takes twice: a cost in Python or a signal's handler that runs within a push is
    then found by `_busy` and refused, instead of waiting for itself for ever.
    """

    __slots__ = ("_lock", "_busy", "_closing")

    def __init__(self):
        self._lock = threading.RLock()
        self._busy = False
        self._closing = False

    def enter(self):
        if self._closing:  # asked before the lock is touched: a loop would else keep it from the thread that closes
            raise ClosedError("the estimator is closed")
        if not self._lock.acquire(False):
            if self._closing:
                raise ClosedError("the estimator is closed")
            raise ThreadError("this estimator is at work in another thread; one estimator belongs to one thread at a "
                              "time")
        if self._busy:
            self._lock.release()
            raise ThreadError("this estimator is at work in this very thread, whose push() is not back yet")
        self._busy = True
        if self._closing:
            self.leave()
            raise ClosedError("the estimator is closed")

    def leave(self):
        self._busy = False
        self._lock.release()

    def last(self):
        """Waits for the one that is at work; nobody enters after it. To be left like any other turn."""
        self._closing = True
        self._lock.acquire()
        if self._busy:
            self._closing = False
            self._lock.release()
            raise ThreadError("the estimator is at work in this very thread: close it when push() is back")
        self._busy = self._closing = True
