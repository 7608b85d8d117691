# Prints "NAMESPACE::TYPE<TAB>FILE:LINE" for each type that a source defines outside an unnamed namespace.
FNR == 1 { space = ""; is_unnamed = 0 }
/^namespace [A-Za-z0-9_:]+ \{/ { space = $2 }
/^namespace \{/ { is_unnamed = 1 }
/^\}  \/\/ namespace$/ { is_unnamed = 0 }
!is_unnamed && /^(struct|class|enum class|enum) [A-Za-z0-9_]+( final)?( :[^:].*)? \{/ {
  print space "::" ($1 == "enum" && $2 == "class" ? $3 : $2) "\t" FILENAME ":" FNR
}
