"""The report of a command: one HTML file that needs nothing else, and a workbook and a page of variants.

It shows what it is handed, tables, lines and pictures, and computes nothing. Needs the extra `report`.
"""

from .page import CAPTIONS as CAPTIONS
from .page import Chapter as Chapter
from .page import Figure as Figure
from .page import Report as Report
from .page import Source as Source
from .page import Table as Table
from .page import figure as figure
from .page import heading as heading
from .page import needed as needed
from .page import numbers as numbers
from .page import text as text
from .page import write_report as write_report
from .variants import MOST_ROWS as MOST_ROWS
from .variants import write_variants as write_variants
from .variants import write_workbook as write_workbook
