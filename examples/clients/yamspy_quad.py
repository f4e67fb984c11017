"""Reads the STM32 quadcopter and changes a gain with yamspy: python yamspy_quad.py /dev/pts/3"""

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
        print(f"{board.CONFIG['flightControllerIdentifier']} {board.CONFIG['flightControllerVersion']}")

        until = time.monotonic() + 10
        while board.ANALOG.get("voltage", 0) == 0 and time.monotonic() < until:
            time.sleep(0.2)
            ask(board, "MSP_ANALOG")
        for name in ["MSP_STATUS", "MSP_ATTITUDE", "MSP_RAW_IMU", "MSP_ANALOG", "MSP_RC", "MSP_MOTOR"]:
            ask(board, name)
        # Its pilot calibrates it 3.5 s after the start.
        until, roll, pitch = time.monotonic() + 15, 90, 90
        while max(abs(roll), abs(pitch)) >= 2 and time.monotonic() < until:
            time.sleep(0.2)
            ask(board, "MSP_ATTITUDE")
            roll, pitch, heading = board.SENSOR_DATA["kinematics"]
        print(f"roll {roll} deg, pitch {pitch} deg, heading {heading} deg")
        assert abs(roll) < 2 and abs(pitch) < 2, "it stands, and its pilot has calibrated it"
        print(f"battery {board.ANALOG['voltage']} V")
        assert 7.0 < board.ANALOG["voltage"] < 8.8, "two cells"
        print("sticks", board.RC["channels"])
        assert board.RC["channels"][:4] == [1500, 1500, 1500, 1000], "let go, throttle down"
        print("motors", board.MOTOR_DATA)
        assert board.MOTOR_DATA[:4] == [1000] * 4

        ask(board, "MSP_PID")
        before = [list(row) for row in board.PIDs]
        print(before)
        # Gains of the document: 0.2, 0.02 and 0.002 about roll; 75 Hz, 50 degrees, 1.0.
        assert before[0] == [20, 20, 20] and before[5] == [75, 5, 10], before

        wanted = [list(row) for row in before]
        wanted[0][0] = 25
        ask(board, "MSP_SET_PID", [byte for row in wanted for byte in row])
        # The parameters in use are those of the next hundredth of a second.
        time.sleep(0.2)
        ask(board, "MSP_PID")
        assert board.PIDs == wanted, board.PIDs
        ask(board, "MSP_EEPROM_WRITE")

        # Out of the parameter's range: nothing is changed.
        wild = [byte for row in wanted for byte in row]
        wild[7 * 3] = 0
        board.send_RAW_msg(MSPy.MSPCodes["MSP_SET_PID"], data=wild)
        assert board.receive_msg()["packet_error"] == 1
        ask(board, "MSP_RESET_CONF")
        time.sleep(0.2)
        ask(board, "MSP_PID")
        assert board.PIDs == before, board.PIDs
        print("a gain was changed, kept, refused out of range, and reset")


main()
