"""Asks the command line over TCP: python console.py 127.0.0.1:2323"""

import socket
import sys


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


main()
