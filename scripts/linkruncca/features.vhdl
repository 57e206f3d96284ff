-- What LinkRunCCA accumulates for each component here: area and sums of coordinates, as wide as in contactfpga's
-- records. The package `sheet` is written for each size.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

use work.sheet.all;

package vhdl_linkruncca_pkg is
    constant mem_add_bits: integer := label_bits;

    type linkruncca_collect_t is record
        in_label: std_logic;
        x: unsigned(x_bits - 1 downto 0);
        y: unsigned(y_bits - 1 downto 0);
    end record;

    type linkruncca_feature_t is record
        area: unsigned(area_bits - 1 downto 0);
        sum_x: unsigned(sum_x_bits - 1 downto 0);
        sum_y: unsigned(sum_y_bits - 1 downto 0);
    end record;

    function linkruncca_feature_empty_val return linkruncca_feature_t;
    function linkruncca_feature_collect(a: linkruncca_collect_t) return linkruncca_feature_t;
    function linkruncca_feature_merge(a, b: linkruncca_feature_t) return linkruncca_feature_t;
end;

package body vhdl_linkruncca_pkg is
    function linkruncca_feature_empty_val return linkruncca_feature_t is
        variable nothing: linkruncca_feature_t;
    begin
        nothing.area := (others => '0');
        nothing.sum_x := (others => '0');
        nothing.sum_y := (others => '0');
        return nothing;
    end;

    function linkruncca_feature_collect(a: linkruncca_collect_t) return linkruncca_feature_t is
        variable cell: linkruncca_feature_t;
    begin
        cell := linkruncca_feature_empty_val;
        -- It also collects cells that it has filled in to join neighbors across a corner.
        if a.in_label = '1' then
            cell.area := to_unsigned(1, area_bits);
            cell.sum_x := resize(a.x, sum_x_bits);
            cell.sum_y := resize(a.y, sum_y_bits);
        end if;
        return cell;
    end;

    function linkruncca_feature_merge(a, b: linkruncca_feature_t) return linkruncca_feature_t is
        variable both: linkruncca_feature_t;
    begin
        both.area := a.area + b.area;
        both.sum_x := a.sum_x + b.sum_x;
        both.sum_y := a.sum_y + b.sum_y;
        return both;
    end;
end;
