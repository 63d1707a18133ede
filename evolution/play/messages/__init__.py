"""Messages: what the page and the server of the playground send to each other, as JSON.

Every message is checked when it arrives. An unknown key, a value of another type or a number out of range is refused in
one line. SI units; angles in rad, counter-clockwise from +x; row 0 of every grid is the lowest y.
"""
