"""The one error that a user sees: a line with the file or channel, the reason, and what to do."""


class Refused(Exception):
    pass


def listed(names, before="; there are ", most=20):
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return before + ", ".join(names[:most]) + more if names else ""


def gathered(*calls):
    """What the calls return; what any of them refuse, in one line."""
    found, said = [], []
    for call in calls:
        try:
            found.append(call())
        except Refused as error:
            said.append(str(error))
    if said:
        raise Refused("; ".join(said))
    return found
