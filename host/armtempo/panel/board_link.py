"""The panel's connection to its board: opened, lost and opened again, the board's states and messages."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from threading import Event as ThreadEvent
from threading import Thread

from armtempo.basics.errors import ArmtempoError, LinkError, PortInUseError
from armtempo.link.traffic import Chunk, Sink
from armtempo.model.arm import Arm
from armtempo.panel import words
from armtempo.panel.live import Lines, LiveArm
from armtempo.robot.board import Board

LOOK_S = 0.25
"""Interval of status requests while there are no samples."""
_LOG = logging.getLogger("armtempo")


class _Warnings(logging.Handler):
    """Shows the library's warnings on the pages, which a terminal shows too; not those on the panel's own server."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        """Show a warning, in the terminal as well: Python does so only while no handler takes it."""
        if logging.lastResort is not None and not logging.getLogger().handlers:
            logging.lastResort.handle(record)
        if not (text := record.getMessage()).startswith("panel:"):
            self._say(text)


class BoardLink:
    """The connection, and what is known of the board; thread-safe."""

    def __init__(
        self, connect: Callable[[Sink, Callable[[str], object]], Board], port: str, arm: Arm
    ) -> None:
        """``connect`` opens the board's ``port``.

        A board that does not answer, or runs another program, is ``trouble``: the panel can deploy the program.
        Raises InputError or PortInUseError if the port cannot be used, LinkError for a board of another arm.
        """
        self.arm, self.port = arm, port
        self.live = LiveArm(arm)
        self.log = Lines()
        self.traffic = Lines()
        """Messages to and from the board, while ``monitors`` is not empty."""
        self.monitors: set[str] = set()
        """The clients that watch the traffic."""
        self.trouble = ""
        """Text: why the board cannot be reached."""
        self._closed = ThreadEvent()
        self._connect = connect
        self._board: Board | None = None
        self._warnings = _Warnings(self.say)
        self._open()
        _LOG.addHandler(self._warnings)
        self._looker = Thread(target=self._look, name="armtempo panel states", daemon=True)
        self._looker.start()

    def close(self) -> None:
        """Close the board."""
        self._closed.set()
        _LOG.removeHandler(self._warnings)
        self._looker.join(2 * LOOK_S)
        if self._board is not None:
            self._board.close()

    @property
    def board(self) -> Board:
        """The board; raises LinkError while there is none."""
        if self._board is None:
            raise LinkError(self.trouble or words.NO_BOARD, words.NO_BOARD_HINT)
        return self._board

    @property
    def has_board(self) -> bool:
        """Whether a board with the program answered."""
        return self._board is not None

    def _open(self) -> None:
        try:
            board = self._connect(self._take_traffic, self._tell)
        except PortInUseError:
            raise
        except LinkError as error:
            self.trouble = words.of_error(error)
            self.say(self.trouble)
            return
        try:
            board.configure(self.arm)
        except BaseException:
            board.close()
            raise
        board.client.session.listen(self.live.take_event)
        self._board, self.trouble = board, ""

    def _tell(self, text: str) -> None:
        """Show a message about the connection; the first is ``trouble`` until the board reports its state again."""
        self.trouble = self.trouble or words.of_text(text)
        self.say(text)

    def without_board(self, call: Callable[[], object]) -> None:
        """Close the port, run ``call``, which needs it, and open the board again."""
        board, self._board = self._board, None
        if board is not None:
            board.close()
        self.live.state = None  # after the last reader
        try:
            call()
        finally:
            try:
                self._open()
            except LinkError as error:
                self.trouble = words.of_error(error)
                raise

    def say(self, text: str) -> None:
        """Append a line to the log."""
        self.log.add([f"{time.strftime('%H:%M:%S')}  {words.of_text(text)}"])

    def _take_traffic(self, chunk: Chunk, frames: list[str]) -> None:
        if self.monitors:
            self.traffic.add([f"{chunk.time_s:9.3f} {chunk.direction} {frame}" for frame in frames])

    def _look(self) -> None:
        while not self._closed.wait(LOOK_S):
            board = self._board
            try:
                self.live.draw()
                if board is None:
                    continue
                with board.client.session.by_turns(LOOK_S) as mine:
                    if not mine:
                        continue
                    asked_s = time.monotonic()
                    self.live.ask(board)
                    self.trouble = ""
                    self._heard(asked_s)
            except ArmtempoError as error:
                if board is self._board and self.trouble != (trouble := words.of_error(error)):
                    self.trouble = trouble
                    self.say(trouble)
            except Exception:  # a bug: logged, and states continue
                _LOG.exception("panel: the board's state")

    def _heard(self, asked_s: float) -> None:
        """Called with each state of the board, and when it was asked for."""
