"""Results are shared by equal calls while somebody holds them, and go when nobody does."""

import gc
import threading
import time

import numpy as np

from ldtrefl.base.sharing import shared_while_current, shared_while_used


def test_a_result_goes_when_nobody_holds_it() -> None:
    calls = []

    @shared_while_used
    def make(number: int) -> np.ndarray:
        calls.append(number)
        return np.zeros(number)

    held = make(3)
    assert make(3) is held and make(4) is not held and calls == [3, 4]
    del held
    gc.collect()
    make(3)
    assert calls == [3, 4, 3]


def test_threads_that_ask_at_once_get_the_same() -> None:
    made = []

    @shared_while_used
    def make(number: int) -> np.ndarray:
        time.sleep(0.05)
        return np.zeros(number)

    askers = [threading.Thread(target=lambda: made.append(make(3))) for _ in range(4)]
    for asker in askers:
        asker.start()
    for asker in askers:
        asker.join()
    assert len({id(result) for result in made}) == 1


def test_a_result_that_is_no_longer_current_is_made_anew() -> None:
    current: list[np.ndarray] = []

    @shared_while_current(lambda result: any(result is one for one in current))
    def make(number: int) -> np.ndarray:
        return np.zeros(number)

    first = make(3)
    current.append(first)
    assert make(3) is first
    current.clear()
    second = make(3)
    current.append(second)
    assert second is not first and make(3) is second
