SELECT hash FROM audit WHERE hash = :hash
