"""Asks the command line over TCP: python console.py 127.0.0.1:2323"""

import re
import socket
import sys
import time


def main():
    host, port = sys.argv[1].split(":")
    with socket.create_connection((host, int(port)), timeout=5) as line:
        screen = ""

        def ask(text):
            nonlocal screen
            line.sendall(text.encode() + b"\r\n")
            while not screen.endswith("\n> "):
                part = line.recv(4096)
                assert part, "the vehicle has hung up"
                screen += part.decode()
            answer, screen = screen, ""
            return answer

        while not screen.endswith("> "):
            screen += line.recv(4096).decode()
        print(screen.split("\r\n")[0])
        screen = ""
        assert "param set NAME VALUE" in ask("help")
        print(ask("status").replace("\r", ""))
        assert "imu" in ask("sensor")
        assert "there is no such parameter" in ask("param get nonsense")
        # The tab is no key of this editor, and two keys too many are taken back.
        assert "eskf.gate" in ask("param get eskf.gatexx\x7f\x7f")
        assert "motor 1 turns" in ask("motor test 1 10")
        # A parameter that is saved is there after a restart, one that is not is as it was.
        ask("param set hover.thrust 0.3")
        ask("param save")
        ask("param set hover.thrust 0.4")
        time.sleep(1)
        line.sendall(b"reboot\r\n")
        while "type help\r\n> " not in screen:
            part = line.recv(4096)
            assert part, "the vehicle has hung up"
            screen += part.decode()
        screen = ""
        assert re.search(r"hover.thrust +0.3 ", ask("param get hover.thrust"))
        assert re.search(r"awake +[01] s", ask("status"))
        print("restarted with the parameter that was saved")


main()
