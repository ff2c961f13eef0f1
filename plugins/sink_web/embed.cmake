# SPDX-License-Identifier: Apache-2.0
# embed.cmake: -DIN=index.html -DOUT=page.c: the page as an array, so that the plugin needs no file beside it.
file(READ ${IN} bytes HEX)
string(LENGTH "${bytes}" digits)
math(EXPR size "${digits} / 2")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n" bytes "${bytes}")
file(WRITE ${OUT} "#include <stddef.h>\nextern const char web_page[];\nextern const size_t web_page_size;\nconst size_t web_page_size = ${size};\nconst char web_page[] = {\n${bytes}0};\n")
