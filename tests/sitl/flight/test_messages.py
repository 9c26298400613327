"""Messages to the pilot are kept, timed and passed on."""

from sitl.flight.messages import KEPT, Messages, Severity


def test_messages_carry_time_and_severity_to_every_listener():
    messages, heard = Messages(), []
    messages.listeners.append(heard.append)
    messages.time = 12.5
    messages.say(2, "Battery critical: Return")
    assert heard == list(messages.kept)
    assert (heard[0].time, heard[0].severity, heard[0].text) == (12.5, Severity.CRITICAL, "Battery critical: Return")


def test_old_messages_make_room():
    messages = Messages()
    for number in range(KEPT + 10):
        messages.say(Severity.INFO, str(number))
    assert len(messages.kept) == KEPT
    assert messages.kept[0].text == "10"
