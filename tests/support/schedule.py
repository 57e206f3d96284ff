"""Threads that run one at a time, and change wherever one takes or gives back a lock, as random numbers say.

:class:`Schedule` stands in for the module ``threading`` in the module under test. A seed is a history: the same locks
are taken in the same order whenever it runs, on every machine.
"""

import math
import threading

PAUSES = (3, 30, 300)
"""Steps for which a thread is left out: others take their turns meanwhile."""

MOST_STEPS = 200_000
"""More than any history takes that ends."""


class Stuck(BaseException):
    """No thread can go on, or they go on for ever."""


class _Seat:
    """One thread: when it may go on, and what wakes it."""

    def __init__(self, name):
        self.name = name
        self.ready = None  # a function, once the thread waits for something
        self.until = math.inf
        self.left_out = 0  # up to this step
        self.done = False
        self.turn = threading.Semaphore(0)


class Schedule:
    """``rng`` decides who goes on; ``clock`` has the seconds on which waits time out; at a share ``pauses`` of all
    steps a thread is left out for a while."""

    get_ident = staticmethod(threading.get_ident)

    def __init__(self, rng, clock, pauses=0.03):
        self.rng = rng
        self.clock = clock
        self.pauses = pauses
        self.steps = 0
        self.failures = []
        self._main = _Seat("main")
        self._seats = {threading.get_ident(): self._main}
        self._stuck = None

    # ---- of the test

    def run(self, *functions):
        """Run these beside each other to their ends; what one raises is raised here."""
        seats = [self._start(function, f"thread {number}") for number, function in enumerate(functions)]
        self.pause(lambda: all(seat.done for seat in seats))
        if self.failures:
            raise self.failures[0]

    def pause(self, ready=None, until=math.inf):
        """Others may go on here; returns once ``ready()``, or at the time ``until``."""
        seat = self._seats[threading.get_ident()]
        seat.ready, seat.until = ready, until
        self.steps += 1
        if ready is None and self.rng.random() < self.pauses:
            seat.left_out = self.steps + self.rng.choice(PAUSES)
        self._next().turn.release()
        seat.turn.acquire()
        if self._stuck is not None:
            raise Stuck(self._stuck)
        seat.ready = None

    def rest(self):
        """The same, after a while in which others have gone on."""
        self._seats[threading.get_ident()].left_out = self.steps + self.rng.choice(PAUSES)
        self.pause()

    def _next(self):
        waiting = [seat for seat in self._seats.values() if not seat.done]
        if self._stuck is None and self.steps > MOST_STEPS:
            self._stuck = f"no end after {self.steps} steps: {self._described(waiting)}"
        if self._stuck is not None:
            return next((seat for seat in waiting if seat is not self._main), self._main)
        able = [seat for seat in waiting if seat.ready is None or seat.ready() or self.clock() >= seat.until]
        if not able:
            timed = [seat for seat in waiting if seat.until < math.inf]
            if not timed:
                self._stuck = f"no thread can go on: {self._described(waiting)}"
                return self._next()
            return min(timed, key=lambda seat: seat.until)  # the time passes, as nothing else happens
        awake = [seat for seat in able if seat.left_out <= self.steps]
        return self.rng.choice(awake or able)

    def _described(self, waiting):
        return ", ".join(seat.name for seat in waiting)

    def _start(self, function, name):
        seat = _Seat(name)

        def body():
            self._seats[threading.get_ident()] = seat
            begun.release()
            seat.turn.acquire()
            try:
                if self._stuck is None:
                    function()
            except BaseException as error:
                self.failures.append(error)
            finally:
                seat.done = True
                del self._seats[threading.get_ident()]
                self._next().turn.release()

        begun = threading.Semaphore(0)
        threading.Thread(target=body, name=name, daemon=True).start()
        begun.acquire()
        return seat

    # ---- in place of the module

    def Thread(self, target, name, daemon):  # noqa: N802
        """One that the schedule knows."""
        schedule = self

        class Started:
            def start(self):
                schedule._start(target, name)

        return Started()

    def Lock(self):  # noqa: N802
        return _Lock(self, again=False)

    def Condition(self):  # noqa: N802
        return _Condition(self)


class _Lock:
    def __init__(self, schedule, again):
        self._schedule = schedule
        self._again = again  # whether who has it may take it again
        self._owner, self._depth = None, 0

    def acquire(self, timeout=-1.0):
        me, schedule = threading.get_ident(), self._schedule
        until = math.inf if timeout < 0 else schedule.clock() + timeout
        schedule.pause()
        if not (self._again and self._owner == me):
            while self._owner is not None:
                if schedule.clock() >= until:
                    return False
                schedule.pause(lambda: self._owner is None, until)
        self._owner = me
        self._depth += 1
        return True

    def release(self):
        assert self._owner == threading.get_ident(), "a lock was given back that another thread has"
        self._depth -= 1
        if not self._depth:
            self._owner = None
            self._schedule.pause()

    __enter__ = acquire

    def __exit__(self, *_):
        self.release()


class _Condition(_Lock):
    def __init__(self, schedule):
        super().__init__(schedule, again=True)
        self._waiting = []

    def wait(self, timeout=None):
        assert self._owner == threading.get_ident()
        depth, notified = self._depth, []
        self._owner, self._depth = None, 0
        self._waiting.append(notified)
        until = math.inf if timeout is None else self._schedule.clock() + timeout
        try:
            self._schedule.pause(lambda: notified, until)
        finally:
            self._waiting = [one for one in self._waiting if one is not notified]
        self.acquire()
        self._depth = depth
        return bool(notified)

    def notify_all(self):
        assert self._owner == threading.get_ident(), "notified without the lock"
        for notified in self._waiting:
            notified.append(True)
