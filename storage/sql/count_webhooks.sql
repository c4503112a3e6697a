SELECT count(*) FROM webhook WHERE project = ?1
