"""Messages to the user: short notes that pass, and failures that stay until read."""

from __future__ import annotations

import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app.errors import InputError
from app.scene import SceneError

NOTE_SECONDS, FAILURE_SECONDS = 4.0, 12.0
MOST = 4
"""How many messages are shown at once; the oldest go first."""


@dataclass(frozen=True, slots=True)
class Message:
    """A sentence, whether it is a failure, and when it goes [s, monotonic clock]."""

    text: str
    is_failure: bool
    until: float


class Messages:
    """The messages of the moment, oldest first."""

    def __init__(self) -> None:
        self._shown: list[Message] = []

    @property
    def shown(self) -> tuple[Message, ...]:
        return tuple(self._shown)

    def clear(self) -> None:
        """Take all messages away."""
        self._shown.clear()

    def note(self, text: str) -> None:
        """Say something that went well."""
        self._add(text, False, NOTE_SECONDS)

    def failure(self, text: str) -> None:
        """Say what did not work; a click takes it away."""
        self._add(text, True, FAILURE_SECONDS)

    def dismiss(self, message: Message) -> None:
        """Take one message away."""
        self._shown.remove(message)

    def expire(self) -> None:
        """Take those away whose time is over."""
        now = time.monotonic()
        self._shown = [message for message in self._shown if message.until > now]

    @contextmanager
    def guard(self) -> Iterator[None]:
        """Do something for the user; say what did not work instead of ending the program."""
        try:
            yield
        except (InputError, SceneError, OSError) as failure:
            self.failure(str(failure))
        except Exception as failure:
            traceback.print_exc()
            self.failure(f"Something went wrong: {failure}")

    def _add(self, text: str, is_failure: bool, seconds: float) -> None:
        kept = [message for message in self._shown if message.text != text]
        kept.append(Message(text, is_failure, time.monotonic() + seconds))
        self._shown = kept[-MOST:]
