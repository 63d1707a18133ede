"""Reading files of strangers: bounded in size, refused in one line."""
