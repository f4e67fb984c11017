"""Reads a vehicle and changes a gain with yamspy: python yamspy_tune.py /dev/pts/3"""

import sys
import time

from yamspy import MSPy


def ask(board, name, data=()):
    """Asks, and has the answer taken apart."""
    assert board.send_RAW_msg(MSPy.MSPCodes[name], data=list(data))
    answer = board.receive_msg()
    assert answer["packet_error"] == 0, f"{name}: {answer}"
    board.process_recv_data(answer)


def main():
    with MSPy(device=sys.argv[1], logfilename=None, loglevel="WARNING") as board:
        assert board != 1, "no vehicle"
        config = board.CONFIG
        print(f"{config['flightControllerIdentifier']} {config['flightControllerVersion']}, named {config['name']}")

        # Its battery monitor needs a moment after power-on.
        until = time.monotonic() + 10
        while board.ANALOG.get("voltage", 0) == 0 and time.monotonic() < until:
            time.sleep(0.2)
            ask(board, "MSP_ANALOG")
        for name in ["MSP_STATUS_EX", "MSP_ATTITUDE", "MSP_ALTITUDE", "MSP_RAW_IMU", "MSP_ANALOG", "MSP_RC", "MSP_MOTOR"]:
            ask(board, name)
        roll, pitch, heading = board.SENSOR_DATA["kinematics"]
        print(f"roll {roll} deg, pitch {pitch} deg, heading {heading} deg")
        assert abs(roll) < 5 and abs(pitch) < 5, "it stands"
        accel = [number / 512 for number in board.SENSOR_DATA["accelerometer"]]
        assert abs(accel[2] + 1.0) < 0.1, accel
        print(f"specific force {accel[2]:.2f} g, battery {board.ANALOG['voltage']} V")
        assert 3.0 < board.ANALOG["voltage"] < 4.5
        print("sticks", board.RC["channels"])
        print("motors", board.MOTOR_DATA)
        assert board.MOTOR_DATA == [1000] * 4 + [0] * 4

        ask(board, "MSP_PIDNAMES")
        ask(board, "MSP_PID")
        before = [list(row) for row in board.PIDs]
        print(", ".join(f"{name} {row}" for name, row in zip(board.PIDNAMES, before)))

        wanted = [list(row) for row in before]
        wanted[0][0] += 5
        ask(board, "MSP_SET_PID", [byte for row in wanted for byte in row])
        ask(board, "MSP_PID")
        assert board.PIDs == wanted, board.PIDs
        print(f"{board.PIDNAMES[0]} P is {board.PIDs[0][0]}")
        ask(board, "MSP_EEPROM_WRITE")

        # Out of the parameter's range: nothing is changed.
        wild = [byte for row in wanted for byte in row]
        wild[9] = 255
        board.send_RAW_msg(MSPy.MSPCodes["MSP_SET_PID"], data=wild)
        assert board.receive_msg()["packet_error"] == 1
        ask(board, "MSP_PID")
        assert board.PIDs == wanted, board.PIDs
        ask(board, "MSP_SET_PID", [byte for row in before for byte in row])
        print("a gain was changed, kept, refused out of range, and put back")

        # As a display asks.
        begun, count = time.monotonic(), 0
        while time.monotonic() < begun + 1.0:
            ask(board, "MSP_ATTITUDE")
            count += 1
        print(f"{count} attitudes in a second")
        assert count > 20


main()
