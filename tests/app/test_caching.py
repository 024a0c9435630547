"""The cache that bounds what a long drag of a large outline leaves in memory."""

from __future__ import annotations

from app.caching import ByteCache


def test_bytes_are_bounded_and_the_oldest_goes_first() -> None:
    made: list[int] = []

    def make(n: int) -> bytes:
        made.append(n)
        return bytes(n)

    cache = ByteCache(make, len, 10)
    assert [len(cache(n)) for n in (4, 5, 4, 1)] == [4, 5, 4, 1]
    assert made == [4, 5, 1]
    assert cache.bytes == 10
    cache(3)  # 5 was used least recently
    assert (len(cache), cache.bytes) == (3, 8)
    cache(5)
    assert made == [4, 5, 1, 3, 5]


def test_the_newest_is_kept_whatever_its_size() -> None:
    cache = ByteCache(bytes, len, 10)
    first = cache(99)
    assert cache(99) is first
    cache(1)
    assert (len(cache), cache.bytes) == (1, 1)
