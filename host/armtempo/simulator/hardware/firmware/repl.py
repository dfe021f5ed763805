"""MicroPython's REPL on the serial port: friendly, raw and raw paste (shared/runtime/pyexec.c)."""

import errno
import io
import sys

import machine_state

_CTRL_A, _CTRL_B, _CTRL_C, _CTRL_D, _CTRL_E = 1, 2, 3, 4, 5
_BANNER = "MicroPython v%d.%d.%d; virtual board STM32F4DISC with STM32F407\r\n"
_HELP = 'Type "help()" for more information.\r\n'
_RAW = "raw REPL; CTRL-B to exit\r\n"
_WINDOW = 128


class SoftReset(Exception):
    """Ctrl-D, or SystemExit in the code that was run."""


def send(text):
    """Send text or bytes to the host; waits while it does not read."""
    data = text.encode() if isinstance(text, str) else text
    view = memoryview(data)
    sent = machine_state.serial.put(view)
    while sent < len(data):
        machine_state.pace.idle()
        sent += machine_state.serial.put(view[sent:])


def show(text):
    """Print to the host while the REPL has the port, otherwise to the log."""
    if machine_state.serial.attached:
        send(text.replace("\n", "\r\n"))
    else:
        sys.stderr.write(text)


def board_print(*values, sep=" ", end="\n", file=None):
    """The built-in ``print``."""
    text = sep.join([str(value) for value in values]) + end
    if file is None:
        show(text)
    else:
        file.write(text)


def traceback(error):
    """The text of an exception, without the simulator's own frames."""
    text = io.StringIO()
    sys.print_exception(error, text)
    lines = text.getvalue().split("\n")
    # MicroPython's text on every system
    if isinstance(error, OSError) and error.errno in errno.errorcode:
        lines[-2] = "OSError: [Errno %d] %s" % (error.errno, errno.errorcode[error.errno])
    return "\n".join([line for line in lines if "/hardware/" not in line])


def _first_of(data, one, other):
    """Index of the first of two bytes, or the length."""
    for index, byte in enumerate(data):
        if byte in (one, other):
            return index
    return len(data)


class Repl:
    """The prompt; it keeps its mode. ``names``: the globals of ``__main__``."""

    def __init__(self, raw=False):
        self.raw = raw
        self.names = {"__name__": "__main__"}

    def run(self):
        """Serve the host until it asks for a soft reset."""
        machine_state.serial.interrupt_char = -1  # at the prompt Ctrl-C is an ordinary byte
        machine_state.board.interrupted = False
        try:
            while True:
                if self.raw:
                    self._raw()
                else:
                    self._friendly()
        except SoftReset:
            send("MPY: sync filesystems\r\nMPY: soft reboot\r\n")

    def execute(self, text, name="<stdin>", log=False):
        """Run code; False if it raises (the host gets the traceback). Raises SoftReset on SystemExit."""
        return self._run(lambda: exec(compile(text, name, "exec"), self.names), log)

    def _run(self, action, log=False):
        """Run something with Ctrl-C enabled; True if it raised nothing."""
        machine_state.serial.interrupt_char = _CTRL_C
        try:
            action()
            return True
        except SystemExit:
            raise SoftReset
        except (Exception, KeyboardInterrupt) as error:
            machine_state.serial.interrupt_char = -1
            text = traceback(error)
            if log:
                sys.stderr.write(text)
            self._end_of_output()
            machine_state.serial.attached = True
            send(text.replace("\n", "\r\n"))
            return False
        finally:
            machine_state.serial.interrupt_char = -1

    def _end_of_output(self):
        """Send the separator between output and errors in raw mode."""
        if self._marking:
            self._marking = False
            send("\x04")

    _marking = False

    def _bytes(self, most):
        """The received bytes, at least one, at most ``most``."""
        while not machine_state.serial.received:
            machine_state.pace.idle()
        return machine_state.serial.take(most)

    def _byte(self):
        return self._bytes(1)[0]

    # raw

    def _raw(self):
        command = bytearray()
        send(_RAW + ">")
        while self.raw:
            byte = self._byte()
            if byte == _CTRL_A:
                if command == b"\x05A":
                    self._paste()
                elif command[:1] == b"\x05":
                    send("R\x00")
                else:
                    send(_RAW)
            elif byte == _CTRL_B:
                self.raw = False
                send("\r\n")
                return
            elif byte == _CTRL_D:
                send("OK")
                if not command:
                    send("\r\n")
                    raise SoftReset
                self._execute_raw(bytes(command))
            elif byte != _CTRL_C:
                command.append(byte)
                continue
            command = bytearray()
            if byte != _CTRL_C:
                send(">")

    def _execute_raw(self, command):
        self._marking = True
        self._run(lambda: exec(compile(command.decode(), "<stdin>", "exec"), self.names))
        self._end_of_output()
        send("\x04")

    def _paste(self):
        """Receive code with flow control: the host sends one window at a time."""
        send(b"R\x01" + bytes((_WINDOW, 0, 1)))
        command = bytearray()
        left = _WINDOW
        while True:
            piece = self._bytes(left)
            stop = _first_of(piece, _CTRL_C, _CTRL_D)
            command.extend(piece[:stop])
            if stop < len(piece):
                break
            left -= len(piece)
            if not left:
                left = _WINDOW
                send("\x01")
        send("\x04")
        if piece[stop] == _CTRL_D:
            self._execute_raw(bytes(command))

    # friendly

    def _friendly(self):
        send(_BANNER % tuple(sys.implementation.version[:3]) + _HELP)
        block = ""
        while not self.raw:
            send("... " if block else ">>> ")
            line = self._line(bool(block))
            if line is None:
                return
            if block or line.rstrip().endswith(":"):
                block += line + "\n"
                if line:
                    continue
                line, block = block, ""
            if line.strip():
                self._run(lambda text=line: self._one(text))

    def _one(self, text):
        """Run what was typed; print the value of an expression."""
        try:
            code = compile(text, "<stdin>", "eval")
        except SyntaxError:
            exec(compile(text, "<stdin>", "exec"), self.names)
            return
        value = eval(code, self.names)
        if value is not None:
            show(repr(value) + "\n")

    def _line(self, inside):
        """A line from the host, echoed; None if the mode changes."""
        line = bytearray()
        while True:
            byte = self._byte()
            if byte == _CTRL_A:
                self.raw = True
                return None
            if byte == _CTRL_B:
                send("\r\n")
                return None
            if byte == _CTRL_D and not line and not inside:
                send("\r\n")
                raise SoftReset
            if byte == _CTRL_C:
                send("\r\n")
                return ""
            if byte in b"\r\n":
                send("\r\n")
                return "".join([chr(byte) for byte in line])  # any bytes, without an error
            if byte in b"\x08\x7f":
                if line:
                    line = line[:-1]
                    send("\x08 \x08")
            elif byte >= 32 or byte == 9:
                line.append(byte)
                send(bytes((byte,)))
