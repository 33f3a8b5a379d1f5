"""nginx in front of a server, at http://127.0.0.1:PORT/vdi/, with the example of docs/live.md or with other settings."""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import time

NGINX = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin")
GUIDE = pathlib.Path(__file__).parents[2] / "docs" / "live.md"
# What many sites have: the request that arrives names the server's own address as its host.
USUAL = """location /vdi/ {
    proxy_pass http://127.0.0.1:8080/;
    proxy_http_version 1.1;
    proxy_set_header Upgrade $http_upgrade;
    proxy_set_header Connection "upgrade";
}
"""
BARE = "location /vdi/ { proxy_pass http://127.0.0.1:8080/; proxy_set_header Host $http_host; }\n"


def example():
    """The guide's example."""
    return re.search(r"```nginx\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)[1]


class Nginx:
    def __init__(self, port, location):
        self.folder = tempfile.TemporaryDirectory()
        folder = self.folder.name
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.origin = f"http://127.0.0.1:{self.port}"
        self.address = self.origin + "/vdi/"
        kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        temporary = "\n".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
        conf = pathlib.Path(folder) / "nginx.conf"
        conf.write_text(("user root;\n" if os.geteuid() == 0 else "") + f"""daemon off; pid {folder}/pid; error_log stderr crit;
          events {{}}
          http {{ access_log off; {temporary}
          server {{ listen 127.0.0.1:{self.port}; {location.replace(":8080", f":{port}")} }} }}""", encoding="utf-8")
        self.process = subprocess.Popen([NGINX, "-p", folder, "-c", str(conf), "-e", "stderr"])
        until = time.monotonic() + 60
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                return
            except OSError:
                if self.process.poll() is not None or time.monotonic() > until:
                    self.close()
                    raise
                time.sleep(0.02)

    def close(self):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(60)
        self.folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
