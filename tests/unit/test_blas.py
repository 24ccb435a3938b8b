"""Values do not depend on the threads of BLAS, nor on what was asked before."""

import subprocess
import sys
import threading

import mpmath
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from elastica.blas import single_threaded
from elastica.stability.quadrature import gauss_legendre

MANY = """
import sys
import numpy as np
import elastica
from threadpoolctl import threadpool_limits
P = np.linspace(300, 400, 5)
with threadpool_limits(limits=int(sys.argv[1])):
    words = elastica.solve("UDUDUDUDUDUDUDUD", P=P[:2], H=0.01)
    free = elastica.solve("B3", P=np.linspace(10, 15, 8), H=0.4)
    links = elastica.solve("U", P=2.5, H=0.1, method="chain", links=12_000)
    values = [words.eigenvalues(8), words.frequencies(6), free.eigenvalues(8), free.frequencies(6),
              links.curvature, links.energy, links.eigenvalues(3)]
sys.stdout.buffer.write(b"".join(np.ascontiguousarray(value).tobytes() for value in values))
"""


def answer(threads):
    run = subprocess.run([sys.executable, "-c", MANY, str(threads)], capture_output=True, check=True)
    return np.frombuffer(run.stdout)


def test_as_many_threads_as_there_may_be_give_the_same_bits():
    one, two = answer(1), answer(2)
    assert np.isfinite(one).sum() > 140
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("number", [1, 2, 3, 12, 60, 161])
def test_nodes_and_weights_integrate_as_they_should(number):
    nodes, weights = gauss_legendre(number)
    assert (np.diff(nodes) > 0).all()
    assert weights.sum() == pytest.approx(2, abs=4e-15)
    with mpmath.workdps(40):
        for node, weight in list(zip(nodes, weights, strict=True))[number // 2 :: 7]:
            root = mpmath.mpf(node)
            for _ in range(3):
                value, below = mpmath.legendre(number, root), mpmath.legendre(number - 1, root)
                slope = number * (below - root * value) / (1 - root**2)
                root -= value / slope
            assert abs(node - root) < 2e-16
            assert abs(weight - 2 / ((1 - root**2) * slope**2)) < 1e-15


def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@single_threaded
def look(meet, found):
    meet()
    found.append(threads())


def test_threads_of_python_do_not_disturb_each_other():
    found, inside, leave = [], threading.Event(), threading.Event()
    before = threads()

    def wait():
        inside.set()
        leave.wait()

    first = threading.Thread(target=look, args=(wait, found))
    second = threading.Thread(target=look, args=(lambda: None, found))
    first.start()
    inside.wait()
    second.start()
    leave.set()
    for thread in (first, second):
        thread.join()
    assert found == [{1}, {1}]
    assert threads() == before


def test_threads_are_given_back_after_an_error():
    def fail():
        raise ArithmeticError

    with threadpool_limits(limits=2):
        with pytest.raises(ArithmeticError):
            look(fail, [])
        assert threads() == {2}
