"""A viewer of a VDI server in plain Python, and a server for one viewer, after docs/live.md and RFC 6455: they share no code
with the product."""
import base64
import hashlib
import json
import os
import socket
import struct

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Closed(Exception):
    """The server closed the connection."""

    def __init__(self, code, reason=""):
        super().__init__(f"{code} {reason}")
        self.code = code
        self.reason = reason


class Refused(Exception):
    """The server answered with HTTP but opened no WebSocket."""

    def __init__(self, status):
        super().__init__(str(status))
        self.status = status


def masked_by(payload, mask):
    return bytes(b ^ mask[i % 4] for i, b in enumerate(payload))


class Peer:
    """One end of a connection. Its functions raise socket.timeout rather than wait for ever."""

    MASKS = True  # the frames that it sends, as a viewer must

    def __init__(self, connected):
        self.socket = connected
        self.buffer = b""

    def head(self):
        """The HTTP head before the first frame."""
        while b"\r\n\r\n" not in self.buffer:
            self.fill()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        return head.decode()

    def close(self):
        self.socket.close()

    def fill(self):
        got = self.socket.recv(1 << 16)
        if not got:
            raise Closed(1006)
        self.buffer += got

    def read(self, count):
        while len(self.buffer) < count:
            self.fill()
        got, self.buffer = self.buffer[:count], self.buffer[count:]
        return got

    def send_frame(self, opcode, payload):
        bit = 0x80 if self.MASKS else 0
        size = len(payload)
        head = bytes([0x80 | opcode])
        if size < 126:
            head += bytes([bit | size])
        elif size < 1 << 16:
            head += bytes([bit | 126]) + struct.pack(">H", size)
        else:
            head += bytes([bit | 127]) + struct.pack(">Q", size)
        if self.MASKS:
            mask = os.urandom(4)
            head += mask
            payload = masked_by(payload, mask)
        self.socket.sendall(head + payload)

    def send_text(self, text):
        self.send_frame(TEXT, text.encode())

    def send(self, **message):
        self.send_text(json.dumps(message))

    def message(self):
        """The next message: a dict, or (frame, level, offset, bytes)."""
        payload, kind = b"", None
        while True:
            first, second = self.read(2)
            size = second & 0x7F
            if size == 126:
                size = struct.unpack(">H", self.read(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self.read(8))[0]
            mask = self.read(4) if second & 0x80 else None
            data = self.read(size)
            if mask:
                data = masked_by(data, mask)
            opcode = first & 0xF
            if opcode == CLOSE:
                code = struct.unpack(">H", data[:2])[0] if len(data) >= 2 else 1005
                raise Closed(code, data[2:].decode(errors="replace"))
            if opcode == PING:
                self.send_frame(PONG, data)
                continue
            if opcode == PONG:
                continue
            kind = opcode or kind
            payload += data
            if first & 0x80:
                break
        if kind == TEXT:
            return json.loads(payload)
        return (*struct.unpack("<IIQ", payload[:16]), payload[16:])

    def text_message(self, kind):
        """The next text message of type `kind`. Skips all other messages."""
        while True:
            message = self.message()
            if isinstance(message, dict) and message["type"] == kind:
                return message


class Viewer(Peer):
    def __init__(self, port, timeout=60, origin=None, protocol="pv-vdi.1", target="/stream"):
        super().__init__(socket.create_connection(("127.0.0.1", port), timeout))
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {target} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        if protocol:
            lines.append(f"Sec-WebSocket-Protocol: {protocol}")
        if origin:
            lines.append(f"Origin: {origin}")
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        status = int(self.head().split()[1])
        if status != 101:
            self.close()
            raise Refused(status)

    def hello(self, token, version=1, have=None, **more):
        self.send(type="hello", version=version, token=token, have=have, **more)

    def levels(self):
        """Whole levels, as (announcement, bytes), acknowledged."""
        announced, data = None, b""
        while True:
            message = self.message()
            if isinstance(message, dict):
                if message["type"] == "level":
                    announced, data = message, b""
                continue
            frame, level, offset, part = message
            if announced is None or (frame, level, offset) != (announced["frame"], announced["level"], len(data)):
                raise ValueError("a part is out of order")
            data += part
            if len(data) > announced["bytes"]:
                raise ValueError("a level is too long")
            done = len(data) == announced["bytes"]
            if done or len(data) % (512 << 10) < len(part):
                self.send(type="ack", frame=frame, level=level, bytes=len(data))
            if done:
                yield announced, data
                announced, data = None, b""

    def end(self):
        """Reads until the server closes the connection; returns the code."""
        try:
            while True:
                self.message()
        except Closed as closed:
            return closed.code
        except ConnectionError:
            return 1006


class OneViewer(Peer):
    """A server's end of the next connection to a socket that listens."""

    MASKS = False

    def __init__(self, listener, timeout=60):
        listener.settimeout(timeout)
        super().__init__(listener.accept()[0])
        self.socket.settimeout(timeout)
        headers = dict(line.split(": ", 1) for line in self.head().split("\r\n")[1:])
        key = {name.lower(): value for name, value in headers.items()}["sec-websocket-key"]
        accepted = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()
        lines = ["HTTP/1.1 101 Switching Protocols", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Accept: {accepted}", "Sec-WebSocket-Protocol: pv-vdi.1"]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())

    def welcome(self, session, steps):
        """`steps` of the series, whose times are the same numbers; None: there's none so far."""
        series = None if steps is None else {"times": steps, "steps": steps}
        self.send(type="welcome", version=1, session=session, steer=False, viewers=1, series=series)

    def send_level(self, frame, data):
        """The only level of a frame."""
        self.send(type="level", frame=frame, level=0, levels=1, bytes=len(data), width=1, height=1, step=frame, time=None,
                  age=0.0, dropped=0)
        for offset in range(0, len(data), 1 << 18):
            self.send_frame(BINARY, struct.pack("<IIQ", frame, 0, offset) + data[offset:offset + (1 << 18)])
