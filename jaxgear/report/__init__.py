"""The report of a command: one HTML file that needs nothing else, and a workbook and a page of variants.

It shows what it is handed, tables, lines and pictures, and computes nothing. Needs the extra `report`.
"""

from .page import Chapter as Chapter
from .page import Figure as Figure
from .page import Part as Part
from .page import Picture as Picture
from .page import Table as Table
from .page import heading as heading
from .page import needed as needed
from .page import numbers as numbers
from .page import picture as picture
from .page import text as text
from .page import write_report as write_report
from .records import Record as Record
from .records import numbers_of as numbers_of
from .records import table_of as table_of
from .variants import MOST_ROWS as MOST_ROWS
from .variants import write_tables as write_tables
from .variants import write_variants as write_variants
from .variants import write_workbook as write_workbook
