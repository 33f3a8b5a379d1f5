# Joins the page's files and writes them to OUTPUT as a C++ literal. FOLDER is web/. MODULES lists
# its modules, separated by commas, each after those that it imports. A page that opens from disk
# can't load modules, so they become one: imports vanish, and exports become plain declarations.
# Top-level names of modules must therefore differ.
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" modules "${MODULES}")
set(script "")
foreach(module IN LISTS modules)
  file(READ "${FOLDER}/${module}.js" text)
  string(REGEX REPLACE "import {[^}]*} from \"[^\"]*\";\n" "" text "${text}")
  string(REGEX REPLACE "(^|\n)export " "\\1" text "${text}")
  if(text MATCHES "(^|\n)(import|export)[ {]")
    message(FATAL_ERROR "${module}.js imports or exports in a way that cmake/EmbedPage.cmake doesn't know")
  endif()
  if(text MATCHES "</script|<!--")
    message(FATAL_ERROR "${module}.js would end the page's script")
  endif()
  # Half of the text is comments and indentation. Comments at the ends of lines stay, because the
  # same characters may be part of a string.
  string(REGEX REPLACE "/\\*\\*([^*]|\\*+[^*/])*\\*+/" "" text "${text}")
  string(REGEX REPLACE "\n[ ]*//[^\n]*" "\n" text "\n${text}")
  string(REGEX REPLACE "\n[ \n]+" "\n" text "${text}")
  string(APPEND script "${text}\n")
endforeach()
file(READ "${FOLDER}/style.css" style)
file(READ "${FOLDER}/index.html" page)
string(REPLACE "@STYLE@" "${style}" page "${page}")
string(REPLACE "@SCRIPT@" "${script}" page "${page}")
file(WRITE "${OUTPUT}" "inline constexpr char pageTemplate[] = R\"=page=(${page})=page=\";\n")
