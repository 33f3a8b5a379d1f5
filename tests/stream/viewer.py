"""A viewer of a VDI server in plain Python, after docs/live.md and RFC 6455: it shares no code with the product."""
import base64
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


class Viewer:
    """One connection. Its functions raise socket.timeout rather than wait for ever."""

    def __init__(self, port, timeout=60, origin=None, protocol="pv-vdi.1", target="/stream"):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {target} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        if protocol:
            lines.append(f"Sec-WebSocket-Protocol: {protocol}")
        if origin:
            lines.append(f"Origin: {origin}")
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            self.fill()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        status = int(head.split()[1])
        if status != 101:
            self.close()
            raise Refused(status)

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
        mask = os.urandom(4)
        size = len(payload)
        head = bytes([0x80 | opcode])
        if size < 126:
            head += bytes([0x80 | size])
        elif size < 1 << 16:
            head += bytes([0x80 | 126]) + struct.pack(">H", size)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", size)
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def send_text(self, text):
        self.send_frame(TEXT, text.encode())

    def send(self, **message):
        self.send_text(json.dumps(message))

    def hello(self, token, version=1, have=None, **more):
        self.send(type="hello", version=version, token=token, have=have, **more)

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
            data = self.read(size)
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
        """Reads until the server closes; gives the code."""
        try:
            while True:
                self.message()
        except Closed as closed:
            return closed.code
        except ConnectionError:
            return 1006
