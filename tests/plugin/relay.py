"""Relays data between a program that listens on port argv[1] of this machine and one that connects
to the relay's port, which the relay prints first. Answers each line of standard input with the
number of bytes relayed so far."""

import socket
import sys
import threading
import time

count = 0


def dial(port):
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except OSError:
            time.sleep(0.1)


def pump(one, other):
    global count
    while True:
        data = one.recv(1 << 16)
        if not data:
            other.close()
            return
        count += len(data)
        other.sendall(data)


def accept(listener):
    caller, _ = listener.accept()
    answerer = dial(int(sys.argv[1]))
    for one, other in ((caller, answerer), (answerer, caller)):
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        threading.Thread(target=pump, args=(one, other), daemon=True).start()


listening = socket.create_server(("127.0.0.1", 0))
print(listening.getsockname()[1], flush=True)
threading.Thread(target=accept, args=(listening,), daemon=True).start()
for _ in sys.stdin:
    print(count, flush=True)
