"""Many datagrams with one call.

While another thread computes, each call of a socket waits for the interpreter's lock, 5 ms by default: one datagram per
call would lose most of a fast stream. Linux's recvmmsg(2) brings all that are there.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct
import sys
from contextlib import suppress

AT_ONCE = 256
"""datagrams of a call at most"""
CONTROL = 64
"""bytes for what comes with a datagram"""
SO_RCVBUFFORCE, SO_RXQ_OVFL = 33, 40
MSG_WAITFORONE = 0x10000
OVERFLOW = struct.Struct("NiiI")
"""cmsg_len, cmsg_level, cmsg_type, and how many datagrams were lost because the buffer was full"""


class _Part(ctypes.Structure):
    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Header(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("parts", ctypes.POINTER(_Part)),
        ("part_count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):
    _fields_ = (("header", _Header), ("received", ctypes.c_uint))


class Receiver:
    """Receives from a bound socket; waits for a first datagram at most `timeout`, s."""

    def __init__(self, bound: socket.socket, longest: int, buffer: int, timeout: float) -> None:
        self.socket = bound
        self.longest = longest
        self.lost = 0
        """datagrams that came while the buffer was full, where the system tells"""
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        bound.settimeout(timeout)
        self.many = _Many(bound, longest, buffer, timeout) if sys.platform == "linux" else None

    def receive(self) -> list[bytes]:
        """Return the datagrams that are there, after waiting for the first; of longer ones `longest` + 1 bytes."""
        if self.many is not None:
            datagrams, self.lost = self.many.receive(), self.many.lost
            return datagrams
        try:
            return [self.socket.recv(self.longest + 1)]
        except TimeoutError:
            return []


class _Many:
    """recvmmsg with its buffers."""

    def __init__(self, bound: socket.socket, longest: int, buffer: int, timeout: float) -> None:
        self.socket = bound
        self.lost = 0
        self.stride = longest + 1
        bound.settimeout(None)
        seconds, fraction = divmod(timeout, 1.0)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", int(seconds), int(1e6 * fraction)))
        bound.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        with suppress(PermissionError):  # what goes beyond the system's limit is for its administrator
            bound.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, buffer)
        self.call = ctypes.CDLL(None, use_errno=True).recvmmsg
        self.data = bytearray(AT_ONCE * self.stride)
        self.control = bytearray(AT_ONCE * CONTROL)
        data = ctypes.addressof(ctypes.c_char.from_buffer(self.data))
        control = ctypes.addressof(ctypes.c_char.from_buffer(self.control))
        self.parts = (_Part * AT_ONCE)(*(_Part(data + k * self.stride, self.stride) for k in range(AT_ONCE)))
        self.messages = (_Message * AT_ONCE)()
        for k, message in enumerate(self.messages):
            message.header.parts, message.header.part_count = ctypes.pointer(self.parts[k]), 1
            message.header.control, message.header.control_length = control + k * CONTROL, CONTROL

    def receive(self) -> list[bytes]:
        count = self.call(self.socket.fileno(), self.messages, AT_ONCE, MSG_WAITFORONE, None)
        if count < 0:
            error = ctypes.get_errno()
            if error in (errno.EAGAIN, errno.EINTR):
                return []
            raise OSError(error, os.strerror(error))
        view = memoryview(self.data)
        datagrams = []
        for k in range(count):
            message, begin = self.messages[k], k * self.stride
            datagrams.append(bytes(view[begin : begin + message.received]))
            if message.header.control_length >= OVERFLOW.size:
                _, level, kind, lost = OVERFLOW.unpack_from(self.control, k * CONTROL)
                if (level, kind) == (socket.SOL_SOCKET, SO_RXQ_OVFL):
                    self.lost = lost
            message.header.control_length = CONTROL
        return datagrams
