SELECT (SELECT count(*) FROM scan WHERE content = ?1) + (SELECT count(*) FROM bones WHERE content = ?1)
